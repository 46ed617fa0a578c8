"""A scene in real time in the browser, with the mouse as the hand: see `reports.view.loop`."""
