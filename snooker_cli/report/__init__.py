"""Numbers and figures of finished runs -> the report; no number in it is typed."""
