"""What a record says: facts of a drop, the quality gate, a first look, the lift check."""
