"""The belt on a pulley: stations land, are held, slide by Coulomb's law, and leave."""
