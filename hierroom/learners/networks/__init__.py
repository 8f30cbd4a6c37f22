"""What a learner trains: the protocol of a network, and the actor-critics that ship."""
