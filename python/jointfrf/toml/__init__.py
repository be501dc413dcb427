"""TOML files read key by key: what is missing, wrong or unknown is one sentence that names file and key."""
