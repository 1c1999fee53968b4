"""Reports on a user's runs and on the source report, whose numbers an audit compares with ours."""
