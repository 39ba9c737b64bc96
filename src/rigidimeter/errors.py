"""The one exception that is meant for the person at the keyboard."""


class UserError(Exception):
    """Something the user can put right, said in one plain sentence.

    The command line prints the sentence and exits with a non-zero status, without a traceback.
    The sentence names the file, the field and the value, and says what would be right.
    """
