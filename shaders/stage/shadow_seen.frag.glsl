layout(location = 0) out float seenOut;

void main() { seenOut = 1.0; }
