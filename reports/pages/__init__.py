"""The pages of the report: convert records to HTML."""
