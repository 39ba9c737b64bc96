"""Which column of a table is which quantity, in what unit, and what its numbers look like."""
