"""`wideberth warmup`: compile every kernel now, so that the first run does not wait for it."""

import typer


def warmup() -> None:
    """Compile all kernels and keep them for later runs."""
    import numba
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from wideberth import kernel_modules
    from wideberth._jit import CACHE_DIRECTORY

    if vars(numba.config)["DISABLE_JIT"]:
        typer.echo("NUMBA_DISABLE_JIT is set: nothing to compile")
        return
    names = kernel_modules.names()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    compiled = loaded = 0
    with Progress(*columns) as progress:
        task = progress.add_task("compiling", total=len(names))
        for name in names:
            progress.update(task, description=name.removeprefix("wideberth."))
            kernels = kernel_modules.warm_up(name)
            if kernels is None:
                progress.console.print(f"{name} has no warmup(): skipped", highlight=False, markup=False)
                kernels = []
            hits = sum(sum(k.stats.cache_hits.values()) for k in kernels)
            loaded += hits
            compiled += sum(len(k.signatures) for k in kernels) - hits
            progress.advance(task)
        progress.update(task, description="all kernels")
    typer.echo(f"{compiled} kernels compiled, {loaded} were compiled before; kept in {CACHE_DIRECTORY}")
