"""From a logger's files to a campaign: ``read`` the files, ``understand`` them by a mapping, ``write`` the folder.

logged = read(["lauf1.csv", "lauf2.csv"])
proposal = understand(logged, {"machine": "test_rig", "runs": {"lauf1": {"tension": "10 N/mm2", "yaw": "0.04 deg"}}})
for question in proposal.missing: ...   # put an answer at question.path of the mapping, and understand again
write(proposal, "my_campaign")
"""

from belt_sim.importing.build import Proposal, mapping_text, understand, write
from belt_sim.importing.columns import LoggedTables
from belt_sim.importing.mapping import Question
from belt_sim.importing.tables import read

__all__ = ["LoggedTables", "Proposal", "Question", "mapping_text", "read", "understand", "write"]
