"""The operator's page: a server in the console's process, and what the page sends and shows."""
