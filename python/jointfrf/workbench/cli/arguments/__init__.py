"""Arguments of the commands: one module for each subcommand, which imports nothing that computes."""
