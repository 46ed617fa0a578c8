"""Contacts (paper sections III to V): shapes, the contact set, impacts, resting forces, laws."""
