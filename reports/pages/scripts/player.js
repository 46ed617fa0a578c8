// Playback: see below.
