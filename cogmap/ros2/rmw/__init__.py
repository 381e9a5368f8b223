"""The protocol of rmw_zenoh, by its design document: keys, tokens, attachments, types, nodes."""
