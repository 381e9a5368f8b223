"""The `cogmap` command."""

from __future__ import annotations

import logging

import click

from cogmap.cli.verbs import add_verbs
from cogmap.runtime.command import run_command
from cogmap.version import VERSION

VERBS = {
    "architecture": (
        "cogmap.cli.architecture:architecture",
        "Write the generated parts of docs/architecture.md.",
    ),
    "bag": ("cogmap.cli.log.command:log", "Another name of `cogmap log`, as ROS has it."),
    "completion": (
        "cogmap.cli.completion:completion",
        "Let a shell complete verbs, options and topics.",
    ),
    "config": ("cogmap.cli.config:print_config", "Print every setting of every module, as TOML."),
    "dashboard": (
        "cogmap.cli.dashboard.command:dashboard",
        "Show the mind in a browser, as it runs or from a log.",
    ),
    "doctor": ("cogmap.cli.doctor.command:doctor", "Find problems, and say how to solve them."),
    "experiment": ("cogmap.cli.experiment.command:experiment", "Run the paper's experiments."),
    "explain": ("cogmap.cli.explain.command:explain", "Explain a moment of a recorded drive."),
    "goal": ("cogmap.cli.goal:goal", "Send the agent somewhere, and print its plan."),
    "graph": ("cogmap.cli.graph:graph", "Show which process uses which topics."),
    "interface": (
        "cogmap.cli.messages.interface:interface",
        "List and show the types of messages.",
    ),
    "keys": ("cogmap.cli.keys.command:keys", "Make keys, by which the bus knows who is who."),
    "log": ("cogmap.cli.log.command:log", "Record, inspect, draw, replay and compare logs."),
    "memory": (
        "cogmap.cli.memory.command:memory",
        "Show, check, export and import long-term memory.",
    ),
    "module": ("cogmap.cli.processes:module", "Run one module as this process."),
    "name": ("cogmap.cli.name:name", "Name an object of the agent's map, or list them."),
    "node": ("cogmap.cli.node:node", "List running processes, and what each one does."),
    "new": ("cogmap.cli.new.command:new", "Write a new codelet or module to begin with."),
    "param": ("cogmap.cli.param:param", "Show the settings of a running system."),
    "ros2": ("cogmap.cli.ros2:ros2", "Let a robot that runs ROS 2 take the place of sim."),
    "router": ("cogmap.cli.processes:router", "Run the router that all modules connect to."),
    "run": ("cogmap.cli.run.command:run", "Drive through a simulated town, or play a recording."),
    "schemes": ("cogmap.cli.schemes:schemes", "Write the guidance schemes learned on a drive."),
    "street": ("cogmap.cli.street:street", "List, close and open streets of the town."),
    "sweep": ("cogmap.cli.sweep.command:sweep_command", "Drive with many seeds and settings."),
    "teleop": ("cogmap.cli.teleop:teleop", "Drive the robot by keys, in the place of motor."),
    "time": ("cogmap.cli.pausing:time_", "Let simulated time stand and pass; begin again."),
    "topic": ("cogmap.cli.topic.command:topic", "Watch topics of a running system; publish."),
    "town": ("cogmap.cli.town.command:town", "Write a town of your own, and draw any town."),
    "train": ("cogmap.training.command:train", "Train the networks of perception."),
    "view": ("cogmap.cli.view.command:view", "Show a running system in Foxglove or Rerun."),
}


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(VERSION, message="cogmap %(version)s")
@click.option("--verbose", is_flag=True, help="Log debugging messages too.")
def cogmap(verbose: bool) -> None:
    """Run LIDA's cognitive cycle with spatial memory, every module a process on a message bus."""
    logging.basicConfig(
        level=logging.DEBUG if verbose else logging.INFO,
        format="%(asctime)s %(message)s",
        datefmt="%H:%M:%S",
    )
    if not verbose:
        logging.getLogger("matplotlib").setLevel(logging.WARNING)  # it says that it looks for fonts


add_verbs(cogmap, VERBS)


def main() -> None:
    """Run the command; what the user can mend is one sentence and exit code 2."""
    run_command(cogmap, "cogmap")


if __name__ == "__main__":
    main()
