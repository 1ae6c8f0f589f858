"""What screens say, as words and tones; no widgets."""
