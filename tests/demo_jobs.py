"""Jobs for processes of their own; nothing heavy is imported with them."""

import time


def slowly_double(board, number):
    """Puts a number on the board, waits, and returns twice the number."""
    board[number] = number
    time.sleep(1.5)
    return 2 * number


def fail(board):
    """Fails."""
    raise ValueError("this one fails")
