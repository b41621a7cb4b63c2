"""Web page of a recording, with a time line."""
