"""The site: what Sphinx needs to build docs/ without a network, and what keeps its words true."""
