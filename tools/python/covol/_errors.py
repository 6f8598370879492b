"""The exception of the module."""


class Error(Exception):
    """What covol raises where it cannot do what was asked.

    Attributes:
        code: "invalid_options", "invalid_input", "io", "unsupported", "numerical" or "cancelled".
        field: the keyword that is wrong, or that would help, "tag_distance" say; None where the message names none.
    """

    def __init__(self, message, code="invalid_input", field=None):
        super().__init__(message)
        self.code = code
        self.field = field

    def __reduce__(self):
        return type(self), (self.args[0], self.code, self.field)
