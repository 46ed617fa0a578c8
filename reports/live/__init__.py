"""The real-time loop (paper section VI) with deadlines, viewer and mouse input; see `reports.live.loop`."""
