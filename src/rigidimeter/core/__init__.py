"""What all islands share: records, settings, files, and the folders of sessions and studies."""
