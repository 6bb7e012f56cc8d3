"""How far a model is off: by run, by place, by tension, and what in the campaign itself looks wrong."""
