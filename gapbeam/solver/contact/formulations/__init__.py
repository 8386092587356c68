"""Contact formulations that change the contact operator: Nitsche and contact points."""
