"""Commands: measure the speed, compile ahead."""
