"""Who may come to a workspace's servers, and what each may do there."""
