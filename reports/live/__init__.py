"""The loop in real time (paper section VI): paced, watched, seen and held; see `reports.live.loop`."""
