"""Shows the following app in a browser; only this part imports aiohttp and textual-serve."""
