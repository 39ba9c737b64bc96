"""What `benchmarks.same_numbers` is made of: inputs, extraction from documents, comparison."""
