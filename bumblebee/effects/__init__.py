"""Effects that a model may lack, an object each: `effects/<room>/<effect>.py` holds all that anybody knows of it.

The simulator (`sim.effects`), the diagnosis and the deployment ask the objects; none has a table of its own. A new
effect is a file here, its law in the stand-in, which shares no code with this, and its test:
docs/adding-an-effect.md.
"""
