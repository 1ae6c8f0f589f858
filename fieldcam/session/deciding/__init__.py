"""The operator's decisions, as rows: what each command writes, and when it is refused."""
