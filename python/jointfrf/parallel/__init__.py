"""Work shared among threads, processes and machines, by any executor of `concurrent.futures`."""
