"""TOML files read key by key: a missing, wrong or unknown key is one sentence that names file and key."""
