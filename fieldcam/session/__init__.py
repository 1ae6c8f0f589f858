"""One walk along the row, as a library: camera, store, analysis, verdict."""
