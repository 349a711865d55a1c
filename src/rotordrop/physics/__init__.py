"""The equations, each in a function that names its source; symbols as in Neisi 2020, SI units."""
