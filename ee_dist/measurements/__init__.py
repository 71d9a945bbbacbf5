"""Measurements from elsewhere: tables and recordings of other formats as our sensor logs, by a mapping in YAML."""
