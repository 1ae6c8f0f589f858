"""Tables that people keep in spreadsheets: any separator, title rows, workbooks of all kinds."""
