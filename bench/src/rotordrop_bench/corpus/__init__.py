"""The corpus: cases with known truth, by which two versions of the estimator are compared.

A case is synthesized, a version looks at it and estimates it by its own command line, and what it says is
scored against the truth into one row of a table. Cases, seeds and limits are frozen by digest.
"""
