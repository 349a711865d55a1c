"""From a record to the unknown parameters of the machine and of the drop (Neisi 2020, section 3)."""
