"""What is measured about the paper that the project starts from."""
