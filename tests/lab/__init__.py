"""Tests on a lab's servers, real ones on this machine: `make lab-test`."""
