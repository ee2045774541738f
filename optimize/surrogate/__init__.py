"""Surrogates: predictions for designs that have not run, from the designs that have."""
