"""How often is the diagnosis right? Sealed campaigns are drawn, answered from their folders, revealed and scored.

The generator of campaigns and the diagnosis do not know each other; this package carries folders and JSON between them.
"""
