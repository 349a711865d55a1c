"""The harness: cases with known truth are synthesized, estimated and scored into one table.

DropBench, whose estimates anybody may make, and the corpus, by which two versions are compared, are groups of
its cases. Cases, seeds and limits are frozen by digest.
"""
