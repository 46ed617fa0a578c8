"""The pages of the report: records in, HTML out."""
