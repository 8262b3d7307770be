"""Kicks and knee strikes."""
