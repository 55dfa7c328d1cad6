// A surface that shows its colour whatever the light.
