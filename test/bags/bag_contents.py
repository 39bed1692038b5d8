"""What is in a bag, message by message."""

from climber_uk.bags.bag import open_bag


def read_messages(path, topics=None):
    """Yield topic, log time [ns] and deserialised message in the order of the log times.

    `topics` selects by full names (default: all); what cannot be read is left out.
    """
    with open_bag(path) as bag:
        for connection, log_time, _, message in bag.messages(
            bag.types if topics is None else topics
        ):
            yield connection.topic, log_time, message
