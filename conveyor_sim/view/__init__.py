"""The page on which one sees a line: a recording packed for it, as one file or piece by piece; `page/` is the page."""
