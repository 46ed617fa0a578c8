"""Force laws from the literature, one file each, with its source: what do they need of a device?"""
