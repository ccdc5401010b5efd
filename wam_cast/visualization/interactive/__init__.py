"""Pages in the browser whose sliders and buttons do something."""
