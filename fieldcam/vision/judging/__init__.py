"""From what a pair shows to its verdict: measures, evidence, findings, reasons."""
