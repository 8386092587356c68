"""The C kernel of a step: a scene as its data, Functional Mock-up Units, live models of reports."""
