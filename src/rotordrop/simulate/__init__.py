"""One drop, computed: case in, named histories with a certificate out."""
