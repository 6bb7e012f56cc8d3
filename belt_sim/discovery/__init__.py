"""Discovery: the search for a law that the library lacks, as an input at one of the five laws of a model."""
