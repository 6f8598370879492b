"""The exception of the module."""


class Error(Exception):
    """Raised by covol if a request cannot be fulfilled.

    Attributes:
        code: "invalid_options", "invalid_input", "io", "unsupported", "numerical" or "cancelled".
        field: the keyword that is wrong, or that could solve the problem, such as "tag_distance"; None if the message names none.
    """

    def __init__(self, message, code="invalid_input", field=None):
        super().__init__(message)
        self.code = code
        self.field = field

    def __reduce__(self):
        return type(self), (self.args[0], self.code, self.field)
