"""Copley-type servo drives controlled by ASCII commands on a serial line."""
