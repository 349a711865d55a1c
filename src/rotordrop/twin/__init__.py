"""The tracked twin: a drop model that follows the record, its parameters and structure found with it."""
