"""`reproduce_paper`: Xu & Liu (2017) as `printed`, made `consistent`, and compared (`study`)."""
