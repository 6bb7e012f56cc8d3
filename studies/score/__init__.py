"""One score instead of rules: a verdict read off the posterior of a table of evidence, beside stored blind answers."""
