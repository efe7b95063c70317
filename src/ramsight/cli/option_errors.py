"""Functions name their arguments in errors; a verb names its options."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand

if TYPE_CHECKING:
    from ramsight.errors import DescriptionError


class Verb(TyperCommand):
    """A verb whose errors name ``--oil-temperature`` where the function below it named ``oil_temperature``."""

    def invoke(self, ctx: Any) -> Any:  # noqa: D102 - as in Click
        from ramsight.errors import DescriptionError

        try:
            return super().invoke(ctx)
        except DescriptionError as error:
            found = self._of_option(error)
            if found is error:
                raise
            raise found from None

    def _of_option(self, error: DescriptionError) -> DescriptionError:
        """The same error with the option's name; what stands in a file keeps its key."""
        names = {one.name: one.opts[0] for one in self.params if one.opts[0].startswith("--")}
        if error.file is not None or error.key not in names:
            return error
        found = type(error)(error.message, key=names[error.key], value=error.value, allowed=error.allowed)
        found.others = error.others
        return found
