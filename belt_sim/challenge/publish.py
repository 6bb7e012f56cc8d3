"""What is published of a challenge."""

def publish(results, folder, config):
    raise NotImplementedError
