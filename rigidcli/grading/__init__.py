"""Homework: judging answers, which are untrusted text, against an assignment."""
